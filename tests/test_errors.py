"""The tree of exceptions is as drawn."""

from proxytune import errors


def test_every_exception_is_in_the_drawing_and_bad_input_and_failed_runs_are_apart():
    names = {name for name, thing in vars(errors).items() if isinstance(thing, type)}
    assert all(name in (errors.__doc__ or "") for name in names)
    assert issubclass(errors.ScoresError, errors.InputError)
    assert issubclass(errors.StoreError, errors.RunError)
    assert not issubclass(errors.RunError, errors.InputError)
