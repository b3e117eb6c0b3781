"""Captures as data of other programs: virtual cameras as pinholes, or all rays as they are."""
