"""Results for people: verdict, pages, tables, figures, viewer."""
