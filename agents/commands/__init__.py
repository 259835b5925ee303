"""The subcommands of `shipgym` and what they print and write."""
