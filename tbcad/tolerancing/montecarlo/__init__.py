"""Simulated builds of the shell: what each one's virtual cameras see."""
