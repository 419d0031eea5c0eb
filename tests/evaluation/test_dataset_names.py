from __future__ import annotations

from fpmatch.evaluation.dataset import load_dataset, with_unique_names


def test_databases_of_one_name_are_called_by_their_folders(make_database):
    text = 'name = "synthetic"\n'
    folders = [make_database("a", toml=text), make_database("b", toml=text), make_database("c")]
    loaded = [load_dataset(folder) for folder in folders]
    assert [d.name for d in with_unique_names(loaded)] == ["a", "b", "c"]
    assert [d.name for d in with_unique_names(loaded[1:])] == ["synthetic", "c"]
    assert [d.impressions for d in with_unique_names(loaded)] == [d.impressions for d in loaded]
