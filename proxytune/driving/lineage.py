"""Earlier code that drives the same episodes as today's, to the last bit: studies that were made by it go on.

Any change in what `effects/` or `driving/` mean makes every episode another one, unless it is stated here that it does
not. tests/driving/test_identity.py fails after such a change, and says the new digest. Then,

- if every episode is proven to be what it was (something was moved or renamed, an effect was added), append the digest
  to SAME_CODE: the episodes keep their name;
- if any episode differs, let SAME_CODE be the new digest alone and empty OF_54760AD: what was kept is other episodes.

This module is no part of what the digest is of.
"""

SAME_CODE = (
    "fe8ac42c83cd70a7928304e0df8b369a9dae86a3c4d198fb4e6a4bb7303b5e7f",
    "8d856fded410f9a6b4828fb7fb8791fae50be3d452e98e549daaddd751990838",
    "0fbbd46b4e353c48e3cfd813ad93c838152e08f779b7d1bb734fbb095aa9ec5f",
    "25287b445f9a33278dabd80c1f2a748eed1e97a7aada1c62148a0217453015ee",
    "560c6fcf838d5a1f165a4c832f91ef66c052dc5e6a018d86e8821c82f8ce09ba",
    "ee96ad59ba57936cdcf90478c33d5866ddf0b6bf557f67d25d93075eeea66c2e",
    "e7afcd8bcf722c7c3dc69d1b72e8843321624c2cb35ad3d9e6fe148b13f82818",
    "d9b6c182f2597522d3a47ea224254bddca73ff07d8cf06026015417f1c4c1594",
    "8665bf1429be4f790845550636c6be36488fd8abad2d7c7c04d92819a7ecd9c2",
    "d43c92de07b5011a427c9ed33d4ca4f567c5591797b2514b6562cab501a7b671",
)
"""What code means that drives the same episodes, the oldest first: that one names them all."""

OF_54760AD = {
    "duckiebot": (
        "1efcd5036c19ecf30dd250002198b11b135867138949e53749499ec664f404bc",
        "1af6058c222d4275ee79257016c62b6264085a7804884d56bdb6803832f8f3f8",
    ),
    "husky": (
        "c364eeb9c2599371414df5e36dede100461061ae28ee3720a95db23fe4056b04",
        "9006030493e8955afccc62cfc48016bda2b8ec1741e86cc4e5bc7f159e7d7809",
    ),
    "irobot_create": (
        "c00e6158203ee29076f43f29950cf3202243e79d3cf14796cc703d135cd0dbaf",
        "cd561ef9f9f4def75ffb7ea51261eb0fd7591f40f217fbe58e1bb95dcecdcae7",
    ),
}
"""Up to commit 54760ad, code and robots were digested by their bytes. For each robot: what its files mean, as they were
then, and what that digest was. SAME_CODE drives the episodes of that commit."""


def named(code: str) -> str:
    """The code that names the episodes of this one."""
    return SAME_CODE[0] if code in SAME_CODE else code


def digest_of_54760ad(robot: str, files: str, code: str) -> bytes | None:
    """How commit 54760ad digested code and robot; None where today's drive other episodes.

    Args:
        robot: Name of the robot.
        files: What its files mean today.
        code: What the code means today.
    """
    if robot not in OF_54760AD or code not in SAME_CODE:
        return None
    then, digest = OF_54760AD[robot]
    return bytes.fromhex(digest) if files == then else None
