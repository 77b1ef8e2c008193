"""Every fault of docs/faults.md, injected."""
