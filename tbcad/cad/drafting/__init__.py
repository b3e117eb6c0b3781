"""What every drawing consists of: sheet, views, dimensions, tables (ISO 128, 129-1, 5456-2)."""
