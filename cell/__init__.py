"""The welding cell: scene, placement, collision, verdicts, reports and the command line."""
