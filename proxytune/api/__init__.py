"""What a Python user calls: whole tasks in one call each, on files or on DataFrames."""
