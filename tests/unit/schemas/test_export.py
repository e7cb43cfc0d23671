"""The committed JSON Schemas are those of the models."""

from axisync_schemas.export import DIRECTORY, MODELS, text


def test_committed_schemas_are_current() -> None:
    committed = {path.name: path.read_text(encoding="utf-8") for path in DIRECTORY.glob("*.json")}
    assert committed == {f"{model.__name__}.json": text(model) for model in MODELS}, "run `make schemas`"
