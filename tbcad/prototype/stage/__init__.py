"""The object stage: post, crown with LEDs, turning disc."""
