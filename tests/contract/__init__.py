"""What BAD_INPUTS.md and the main job promise, through Python and through the command line."""
