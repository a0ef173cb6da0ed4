"""Giving all that one identity of a domain family has to another."""

OF_EARLIER = "instance IN (SELECT id FROM instances WHERE identity = :earlier)"
SAME_THETA = """
    (SELECT renamed.id FROM instances AS renamed JOIN instances AS old USING (theta)
    WHERE renamed.identity = :now AND old.id = instance)"""
RENAMING = (
    "INSERT OR IGNORE INTO instances (identity, theta) SELECT :now, theta FROM instances WHERE identity = :earlier",
    f"UPDATE trials SET instance = {SAME_THETA} WHERE {OF_EARLIER}",
    f"UPDATE OR IGNORE episodes SET instance = {SAME_THETA} WHERE {OF_EARLIER}",
    f"DELETE FROM episodes WHERE {OF_EARLIER}",
    "DELETE FROM instances WHERE identity = :earlier",
    "UPDATE OR IGNORE sweeps SET identity = :now WHERE identity = :earlier",
    "DELETE FROM sweeps WHERE identity = :earlier",
    "UPDATE OR IGNORE sweeps SET replays = :now WHERE replays = :earlier",
    "DELETE FROM sweeps WHERE replays = :earlier",
)
"""What gives one identity's instances, trials, episodes and sweeps to another, step by step."""
