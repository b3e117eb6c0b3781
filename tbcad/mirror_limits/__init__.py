"""What a workshop is told of a shell: limits of each mirror, datums, tolerances in STEP."""
