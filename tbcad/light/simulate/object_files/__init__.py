"""Files of objects: meshes with their colours, unit and axis, as the file has them."""
