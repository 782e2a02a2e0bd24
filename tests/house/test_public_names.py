"""Each public name exists, says what it is, and shows an example that runs."""

import inspect

import plantune


def public():
    """List (name, object) of `plantune.__all__`, and of the stages listed there."""
    for name in plantune.__all__:
        thing = getattr(plantune, name)
        yield name, thing
        if inspect.ismodule(thing):
            for inner in getattr(thing, "__all__", []):
                yield f"{name}.{inner}", getattr(thing, inner)


def is_exception(thing):
    """Tell errors apart: a message needs no example."""
    return inspect.isclass(thing) and issubclass(thing, BaseException)


def test_dir_lists_the_public_names():
    assert set(plantune.__all__) <= set(dir(plantune))


def test_public_names_are_described():
    silent = [
        name
        for name, thing in public()
        if (callable(thing) or inspect.ismodule(thing)) and not (thing.__doc__ or "").strip()
    ]
    assert not silent


def test_public_names_show_an_example():
    bare = [
        name
        for name, thing in public()
        if callable(thing) and not is_exception(thing) and ">>>" not in (thing.__doc__ or "")
    ]
    assert not bare
