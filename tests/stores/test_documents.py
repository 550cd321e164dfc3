"""Documents in folders of this machine and of stores are read, written and created alike."""

import pytest

from derain.stores.documents import Documents, documents_at


@pytest.fixture(params=["folder", "store"])
def documents(request, store, tmp_path) -> Documents:
    place = tmp_path / "out" if request.param == "folder" else "failing://bucket/out/"
    store.faults.refuse, store.faults.cut = 5, 4
    return documents_at(place, ".derain")


def test_documents_are_read_as_they_were_written(documents) -> None:
    assert documents.read("job.json") is None
    assert list(documents.read_each(["job.json"])) == [None]
    names = [f"units/{number}.json" for number in range(9)]
    for name in names:
        documents.write(name, f'"{name}"')
    documents.write(names[0], "[1]")
    contents = list(documents.read_each([names[8], "units/none.json", *names[:2]]))
    assert contents == [b'"units/8.json"', None, b"[1]", b'"units/1.json"']


def test_only_the_first_creates_a_document(documents) -> None:
    documents.create("job.json", '"first"')
    documents.create("job.json", '"second"')
    assert documents.read("job.json") == b'"first"'


def test_nothing_is_left_of_what_is_removed(documents) -> None:
    documents.write("units/a/b.json", "{}")
    documents.remove_all()
    documents.remove_all()
    assert documents.read("units/a/b.json") is None
