"""What the machine would photograph: capture, light field, views, refocusing, studies."""
