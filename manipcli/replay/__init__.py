"""What is seen: robots and scenes as triangles, in a browser or in a picture file."""
