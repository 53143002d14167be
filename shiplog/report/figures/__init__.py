"""Pictures by matplotlib, of plain tables: a file a picture, a line each in `pictures.PICTURES`."""
