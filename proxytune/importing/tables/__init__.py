"""Tables of others: CSV files, trajectories, the MRCLAM data set's files, and arrays; columns, units and rows."""
