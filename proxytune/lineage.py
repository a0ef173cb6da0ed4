"""The names of our code under which episodes are kept; code that plays the same episodes to the last bit has one name.

So have engines that propose the same θ, and shipped learners that learn the same: an entry each, of what
`proxytune.search.engine_code` and `proxytune.learning.learner_identity` digest.

Any change in what the rooms of a family mean makes every episode of that family another one, unless it is stated here
that it does not. tests/test_lineage.py fails after such a change, and says the new digest. Then,

- if every episode is proven to be what it was (something was moved or renamed, an effect was added), append the digest
  to the family's entry of SAME_CODE: the episodes keep their name, and studies that were made before go on;
- if any episode differs, let the new digest alone be the family's entry: what was kept is other episodes.

This module lies outside those rooms, so that what is said here is no part of what the digest is of.
"""

import functools
from pathlib import Path

from proxytune.identity import meaning_of

PACKAGE = Path(__file__).resolve().parent
ROOMS = {"driving": ("effects", "driving"), "environments": ("effects", "environments")}
"""Where the code lies that plays the episodes of a family: every module of these rooms counts."""
ON_OUTPUTS = (
    "169c7ef2065e",
    "bd67473b82b2",
    "79f5fa29af66",
    "bba8741ee1e0",
    "4ae305889b1d",
    "cb79f534eabb",
    "f82ad3cb55f6",
    "4c890121cd60",
)
"""Code of the two engines that learn from outputs, which have a module in common."""
ON_NOTHING = ("40019bb841cc", "aa9b7e2da380", "a00262704239", "8e3a9627dfe6")
"""Code of the design, and of the engines that learn nothing and lie beside it."""
SAME_CODE = {
    "driving": (
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
        "193fc67d257973b214825df8319b0a2bd8fa4f91d07b407e963e05f4ac01ae17",
        "beabf1b09de72cb09f039725e6a0a1f6a5c115ddf0d5d81fab482d31f20e64ce",
        "d25c5bcf4fd754c361049ef436a8d76af15abb1ee1438754a2baf5809ae11957",
        "403d3586904f8c47aa0c58c330753a20fceba77b0d1576d5c0fdec913ba32c6c",
        "5a256e6ec043d1cd8bd6c39c387f8ea37e6beaf03642f97c9217605ae4f0830e",
        "94c2e672161e5eb3819043c1684c3859b44baa7e41800145b32c2bff9d44c7c4",
        "d1c60aa93bdd77976fa65112071f591f3da28059d51ac2212d6e214e993ff820",
        "dc47375fd36dc4589301ccaf4a331ee5a1b35a76593fbed672df4954e55f1a4e",
        "4d7475f410334f3a96d92c4141cf81304858b531b86b58dc8a6ed921757c397a",
        "c7f99e82aa0f59dc2ba40846c46547b51815fc2a445ca38e20cf05ceb776ff4a",
        "c53aec37ea08cc5962596d43314b021e69e072595b4800621ddf451de67e7133",
    ),
    "environments": (
        "f5b9c2c9586c29cd4dc2d6e27f44fd2731ecc2d27bf96a80c745aecd5a3ddb50",
        "efd8ee20ccef978bc76d2d8a4347a02b439e79a2e68d2dd89f86ca5ae1a37343",
        "66964875fbf13cfa088ed0c037d223b9c23bf6430123e1d70b28b5655469b672",
        "cd8c3a2b25d594297615fc6aa9242767b05d6f953a175ac2c3de9b44cdf3a016",
        "d42c81e8a3875759a736db7235c5cf3a713e8edc7f9ca64e5164c3149d2becd5",
        "4c4c6938034f481691acea6d8729b71483aeae192fbc759109a77fd37c052dfa",
        "3347db8c725fed99a9dab5513285b83255ba9d0d595e4b395fe48d69a8408fc7",
        "c5523b5296a6a48b0e23a40895df9c52c004cedb3bdc378686ace873eaa8c948",
        "54a8fd61c63643c8c438e427102c873b84f56fd1f0b4888e779d7e150bb5f8dc",
        "7018647b4590bd6de0ad919cafea716c33f6dd361c083b4182f8dcae19b3acc4",
        "dc963200ccddff2119190c22d2c85b6efe88abcabd84d90cdb8f3f31f83a0357",
    ),
    "engine outcomes": ("94c0ba12f9bf", *ON_OUTPUTS),
    "engine composite": ("82865583b592", *ON_OUTPUTS),
    "engine gp": ("231c6791b2b7", "1dae7f006157", "41a805e87825", "d952ced2ab68", "f2f5943bdb31"),
    "engine random": ("0faabd65d4d9", *ON_NOTHING),
    "engine sobol": ("225f0b0407fb", *ON_NOTHING),
    "engine tpe": (
        "7bbfc93f55ba",
        "5004f0c9a482",
        "dab8e44a497a",
        "ddc23b002b6e",
        "126945151387",
        "36d1df1ab446",
        "c0dacb4b2963",
    ),
    "design": ("3695c894b9c7", *ON_NOTHING),
    "learner proxytune.learning.cloning": (
        "ceb19d953492d57f248e919c7553724e5616f3b383452117639093a35b2ce432",
        "e908368ec773370848637b0baa8b8544376386b4d32f31359ee98a12fd69dde0",
    ),
    "learner proxytune.learning.ridge": (
        "b5ef33d580b8d175c71c0342ddd985ac6c735556a54e619cc2a0a6ff0940e750",
        "b08d0547406f9c356c7a33a177609b4b91d11e09b7c8f6ab8caaf611de84e269",
    ),
}
"""For each family, engine and learner, what code means that does the same, the oldest first, which names them all."""


@functools.lru_cache
def code_meaning(family: str) -> str:
    """A digest of what the code of a family's rooms means, comments and docstrings left out."""
    modules = (path for room in ROOMS[family] for path in (PACKAGE / room).rglob("*.py"))
    return meaning_of(modules, PACKAGE)


def code_name(family: str) -> str:
    """The name of the code of a family's rooms: that of the oldest which plays the same episodes as today's."""
    return named(family, code_meaning(family))


def named(entry: str, code: str) -> str:
    """The name of code: that of the oldest in an entry of SAME_CODE, if this is one of them, else its own."""
    same = SAME_CODE.get(entry, ())
    return same[0] if code in same else code
