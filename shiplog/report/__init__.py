"""What is written and shown: verdict, pages, tables, pictures."""
