"""What a study keeps: study.db, its rows and its lock."""
