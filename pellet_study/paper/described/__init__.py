"""Another paper of this kind: a folder that describes it (paper.toml and tables as CSV), and its audit."""
