"""A log as a diagnosis takes it: drives, their clocks, and which of them are kept aside."""
