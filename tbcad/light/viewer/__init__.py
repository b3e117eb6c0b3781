"""Light fields in a browser: views on request, and turntables to send to somebody."""
