"""The public functions of `import tbcad`, and the command line that calls them."""
