"""The search for better places of cameras and mirrors with the same sensor."""
