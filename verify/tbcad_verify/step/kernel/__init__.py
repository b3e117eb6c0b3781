"""A STEP file as the CAD kernel reads it; nothing else of the verification imports a kernel.

It runs in a process of its own: native code that reads a foreign file may hang or crash.
"""
