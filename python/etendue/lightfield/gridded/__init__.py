"""The gridded algorithm of chapter 3 of the thesis: a ray file as surface sources, each with a table of intensities."""
