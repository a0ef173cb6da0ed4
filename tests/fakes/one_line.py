"""What is wrong with a file, as the user is told."""

from collections.abc import Callable
from typing import Any

import pytest

from proxytune.errors import InputError


def complaint_of(call: Callable[..., Any], *given: Any, **more: Any) -> str:
    """What a call complains of: bad input, in one line."""
    with pytest.raises(InputError) as caught:
        call(*given, **more)
    assert "\n" not in str(caught.value)
    return str(caught.value)
