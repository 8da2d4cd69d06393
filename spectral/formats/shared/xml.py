"""Reading XML that others wrote: no entities, nothing from outside the file, bounded depth and size."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from ....runtime.errors import InputError
from ....runtime.files import existing_file

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

# A measurement of 5000 colours at 1 nm is 30 MB; one element needs some 200 bytes of memory.
MOST_BYTES = 64 * 2**20
MOST_ELEMENTS = 2_000_000
MOST_DEPTH = 100
# Longer text of one field is cut where it is only kept for people to read.
_LONGEST_TEXT = 4000
_MOST = 400
_FIRST_TAG = re.compile(r"<(?:[^\s<>:/!?]+:)?([^\s<>:/!?]+)")


def root_name(head: bytes) -> str | None:
    """Local name of the first element in the first bytes of a file; None where there is none.

    Comments, processing instructions and a document type may come before it.
    """
    for mark, encoding in ((b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be")):
        if head.startswith(mark):
            text = head[2:].decode(encoding, "replace")
            break
    else:
        text = head.removeprefix(b"\xef\xbb\xbf").decode("latin-1")
    text = re.sub(r"<!--.*?(?:-->|$)|<\?.*?(?:\?>|$)", "", text.lstrip(), flags=re.S).lstrip()
    if not text.startswith("<"):
        return None
    if text[:9].upper() == "<!DOCTYPE":
        text = re.sub(r"^<![^\[>]*(?:\[.*?\]\s*)?>", "", text, flags=re.S).lstrip()
    found = _FIRST_TAG.match(text)
    return found[1] if found else None


def read_xml(path: Path) -> Element:
    """Return the root element of a file.

    Raises
    ------
    InputError
        Missing, larger or deeper than any measurement is, not well-formed, or with a declaration of an entity: those
        make a small file huge, or read other files.
    """
    from defusedxml import DefusedXmlException
    from defusedxml.ElementTree import XMLParser

    path = existing_file(path)
    size = path.stat().st_size
    if size > MOST_BYTES:
        raise InputError("the file is too large", found=f"{size} bytes", expected=f"at most {MOST_BYTES} bytes of XML")
    data = path.read_bytes().removeprefix(b"\xef\xbb\xbf").lstrip(b" \t\r\n")
    if not data:
        raise InputError(
            "the file is empty",
            found="nothing but white space" if size else "0 bytes",
            expected="an XML document",
            hint="export or copy it again",
        )
    parser = XMLParser(target=_bounded_tree(), forbid_entities=True, forbid_external=True)
    try:
        parser.feed(data)
        return parser.close()
    except DefusedXmlException as reason:
        raise InputError(
            "the file declares an entity",
            found=type(reason).__name__,
            expected="XML without entities of its own and without other files",
            hint="if you trust it, save it again without its document type",
        ) from None
    # Encodings that expat does not know come as ValueError or LookupError.
    except (SyntaxError, ValueError, LookupError) as reason:
        hint = "the file may be cut short or damaged; export it again"
        raise InputError("not well-formed XML", found=str(reason), hint=hint) from None


def _bounded_tree():
    from xml.etree.ElementTree import TreeBuilder

    class Bounded(TreeBuilder):
        depth = count = 0

        def start(self, tag, attrs):
            self.depth += 1
            self.count += 1
            if self.depth > MOST_DEPTH or self.count > MOST_ELEMENTS:
                deep = self.depth > MOST_DEPTH
                raise InputError(
                    "elements are nested too deeply" if deep else "too many elements",
                    found=f"more than {MOST_DEPTH if deep else MOST_ELEMENTS}",
                    expected="a file of spectra",
                )
            return super().start(tag, attrs)

        def end(self, tag):
            self.depth -= 1
            return super().end(tag)

    return Bounded()


def split_tag(element: Element) -> tuple[str, str]:
    """Namespace ("" for none) and local name."""
    uri, _, name = element.tag.rpartition("}")
    return uri.removeprefix("{"), name


class Vocabulary:
    """Elements by their local names, in the namespaces that this file uses for its format.

    uri : the namespace that the format prescribes; the root's own counts as well, and no namespace.
    """

    def __init__(self, root: Element, uri: str) -> None:
        self.uri, self.root_uri = uri, split_tag(root)[0]
        self._known = {uri, self.root_uri, ""}

    @property
    def note(self) -> str | None:
        """A sentence where the file's namespace is another than the format's."""
        if self.root_uri == self.uri:
            return None
        found = f"namespace {self.root_uri!r}" if self.root_uri else "no namespace"
        return f"the file has {found} instead of {self.uri!r}; its elements were taken by their names"

    def name(self, element: Element) -> str | None:
        """Local name; None for an element of another namespace."""
        uri, name = split_tag(element)
        return name if uri in self._known else None

    def children(self, element: Element | None, *names: str) -> Iterator[Element]:
        """Child elements of these names, all of the vocabulary's without names."""
        for child in () if element is None else element:
            name = self.name(child)
            if name is not None and (not names or name in names):
                yield child

    def child(self, element: Element | None, *path: str) -> Element | None:
        """Return the first child of a name, or along a path of names."""
        for name in path:
            element = next(self.children(element, name), None)
        return element

    def text(self, element: Element | None, *path: str) -> str:
        """Stripped text of an element below; "" where there is none."""
        found = self.child(element, *path)
        return "" if found is None else (found.text or "").strip()


def element_words(element: Element) -> str:
    """Everything that an element holds as one line: names, attributes and text, cut where it is very long."""
    parts: list[str] = []
    waiting, length = [(element, "")], 0
    while waiting and length < _LONGEST_TEXT:
        node, above = waiting.pop()
        place = f"{above}/{split_tag(node)[1]}" if node is not element else ""
        said = [f"{key.rpartition('}')[2]}={value}" for key, value in node.attrib.items()]
        text = " ".join(
            [*said, *(node.text or "").split(), *(word for sub in node for word in (sub.tail or "").split())]
        )
        if text:
            parts.append(f"{place[1:]}: {text}" if place else text)
            length += len(parts[-1])
        waiting += [(child, place) for child in reversed(node)]
    line = "; ".join(parts)
    return line if len(line) <= _LONGEST_TEXT else line[:_LONGEST_TEXT] + " ..."


def kept(details: Mapping[str, str]) -> dict[str, str]:
    """Details as they are kept: those that say something, very long ones cut, and not without end."""
    said = [(name, text) for name, text in details.items() if text]
    out = {
        name[:200]: text if len(text) <= _LONGEST_TEXT else text[:_LONGEST_TEXT] + " ..." for name, text in said[:_MOST]
    }
    return out | ({"not kept": f"{len(said) - _MOST} more details"} if len(said) > _MOST else {})


def number(text: str, field: str) -> float:
    """Return a number as XML Schema writes it (xs:double)."""
    try:
        if "_" in text or not text.isascii():
            raise ValueError
        return float(text)
    except ValueError:
        hint = "decimal commas are not allowed in XML; export with a point" if "," in text else None
        raise InputError(
            "not a number", field=field, found=repr(text[:60]), expected="a number such as 0.25", hint=hint
        ) from None
