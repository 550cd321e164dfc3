"""Small documents are read within bounds, and errors name what is wrong with them."""

from pathlib import Path

import pytest

from derain.errors import LONGEST_REASON, InputError
from derain.files.documents import LARGEST_DOCUMENT, Entry, packaged_or_own, shown

ALIASES = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]\n"
    for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)

BAD_YAML = {
    "aliases": ALIASES,
    "deep": "[" * 10_000,
    "deep_mapping": "{a: " * 500 + "1" + "}" * 500,
    "tag": "!!python/object/apply:os.system [true]",
    "timestamp": "!!timestamp nothing",
    "sixties": ":".join(["1"] * 200) + ".0",
    "digits": "9" * 5000,
    "control": "a: \x07",
    "no text": "\xff\xfe\x00",
}


@pytest.fixture
def path(tmp_path) -> Path:
    return tmp_path / "document.yaml"


@pytest.mark.parametrize("name", BAD_YAML)
def test_bad_yaml_is_one_short_line(name, path) -> None:
    path.write_bytes(BAD_YAML[name].encode("latin-1"))
    with pytest.raises(InputError) as caught:
        Entry.of_yaml(path)
    assert str(path) in str(caught.value)
    assert len(str(caught.value)) < LONGEST_REASON + 500
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    ("text", "line", "key"),
    [("b:\n  - c: 1\n    'a': 1\n    a: 1\n", 4, "a"), ("5: x\n0x5: y\n", 2, "5")],
)
def test_a_key_that_is_there_twice_is_named_with_its_line(path, text, line, key) -> None:
    path.write_text(text)
    with pytest.raises(InputError, match=rf"line {line}: the key '?{key}'? is there twice"):
        Entry.of_yaml(path)


def test_a_document_that_is_too_large_is_not_read(path) -> None:
    path.write_text("a: 1\n" + "#" * LARGEST_DOCUMENT)
    with pytest.raises(InputError, match="more than 1,048,576"):
        Entry.of_yaml(path)
    with pytest.raises(InputError, match="1,048,578 characters"):
        Entry.of_json('"' + "a" * LARGEST_DOCUMENT + '"', "metadata")


@pytest.mark.parametrize("text", ["", "[" * 100_000, "[" * 40 + "]" * 40, "9" * 5000])
def test_bad_json_is_refused(text) -> None:
    with pytest.raises(InputError, match="metadata: not JSON"):
        Entry.of_json(text, "metadata")


@pytest.mark.parametrize(
    "value", [10**400, -(10**400), float("nan"), float("inf"), True, "1", None, [1], {"a": 1}]
)
def test_a_number_is_finite_and_no_truth_value(value) -> None:
    entry = Entry("file", "a.b", value)
    with pytest.raises(InputError, match=r"file: a\.b: "):
        entry.number()
    if isinstance(value, bool | str):  # which are no numbers, but scalars
        assert entry.scalar() is value
        return
    with pytest.raises(InputError, match=r"file: a\.b: "):
        entry.scalar()


def test_many_small_values_in_a_document_are_too_many(path) -> None:
    path.write_text("[" + "[]," * 100_000 + "0]")  # 300 kB, and 10 MB in memory
    for read in (Entry.of_yaml, Entry.of_json_file):
        with pytest.raises(InputError, match="more than 65,536 values"):
            read(path)
    assert len(Entry.of_json_file(path, 100 * LARGEST_DOCUMENT).items()) == 100_001


@pytest.mark.parametrize(
    ("text", "value"),
    [
        *((text, float(text)) for text in ("4e-6", "-1E3", "+.5e+2", "2.5e1", "1.5")),
        ("12", 12),
        *((text, text.strip("'")) for text in ("'4e-6'", "4e-6 m", "e5", "0e1f")),
    ],
)
def test_a_number_with_an_exponent_is_one_with_and_without_a_point(text, value, path) -> None:
    path.write_text(f"a: {text}")
    read = Entry.of_yaml(path).value["a"]
    assert (type(read), read) == (type(value), value)


def test_a_mapping_may_have_numbers_for_keys() -> None:
    for keys in ((0, 3), ("0", "3")):  # of YAML and of JSON
        entry = Entry("file", "classes", dict(zip(keys, ("ground", "rain"), strict=True)))
        assert entry.texts_by_number(9) == {0: "ground", 3: "rain"}
    for key in ("a", "-1", "9" * 5000, "²", 10, True, 1.0, None, 16**5000):
        with pytest.raises(InputError, match="file: classes: "):
            Entry("file", "classes", {key: "a"}).texts_by_number(9)
    with pytest.raises(InputError, match=r"file: classes: .* not a mapping"):
        Entry("file", "classes", []).texts_by_number(9)


def test_values_are_cut_in_messages() -> None:
    nested: object = "x"
    for _ in range(8):
        nested = [nested] * 9  # as aliases stand for one another: 43 million, were it written out
    assert len(shown(nested)) < 400
    assert len(shown({str(n): "y" * 10_000 for n in range(100)})) < 400
    assert shown(16**10_000) == "a number of many digits"


def test_a_name_or_a_path_is_a_file_and_anything_else_is_refused(tmp_path) -> None:
    (own := tmp_path / "mine.yaml").touch()
    files = {"one": tmp_path / "one.yaml", "two": own}
    assert packaged_or_own("two", files, "sensor") == own
    assert packaged_or_own(own, files, "sensor") == own
    for name in ("three", tmp_path, tmp_path / "three.yaml", "one"):
        with pytest.raises(InputError, match=r"no such sensor\. .*a YAML file or one of one, "):
            packaged_or_own(name, files, "sensor")
