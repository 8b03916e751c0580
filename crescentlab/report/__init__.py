"""Reports: what a source says beside what a circuit gives, pictures that are the same each time, pages of text."""
