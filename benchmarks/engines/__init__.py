"""Other engines than YADE, each with its own contact laws, for heaps of the rig `repose`."""
