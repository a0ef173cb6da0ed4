"""Which effects a camera lacks, what is left over, and what frames cannot show."""
