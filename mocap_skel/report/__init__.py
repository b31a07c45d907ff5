"""Results for people to read, from the same objects that the files are written from."""
