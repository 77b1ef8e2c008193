"""Printed numbers of any paper of this kind judged by its printed runs: what the source paper's audit and those of folders share."""
