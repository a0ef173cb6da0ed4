"""An XML file of a user's, changed in a few places: every other byte stays, comments and white space too."""

import difflib
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from xml.parsers import expat
from xml.sax.saxutils import escape, quoteattr

from proxytune.errors import InputError
from proxytune.settings import SETTINGS_MB, check_end

ATTRIBUTE = rb"""\s+%b\s*=\s*("[^"]*"|'[^']*')"""
OPENING = re.compile(rb"""<[^'">]*(?:(?:"[^"]*"|'[^']*')[^'">]*)*>""")


class XmlPatch:
    """A file's elements, and what is to be changed of them; one that cannot be read, or is no XML, is an InputError."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            check_end(path, SETTINGS_MB)
            self._bytes = path.read_bytes()
            self._before = self._bytes.decode("utf-8")
        except (OSError, UnicodeDecodeError) as problem:
            raise InputError(f"{path}: cannot be read ({problem}); check the path, and that it is UTF-8") from None
        # Bytes from where an element begins to behind its first tag, and to before its last one
        self._places: dict[ET.Element, tuple[int, int, int]] = {}
        self._changes: list[tuple[int, int, str]] = []
        builder, parser, open_elements = ET.TreeBuilder(), expat.ParserCreate(), list[tuple[ET.Element, int, int]]()

        def begin(tag: str, attributes: dict[str, str]) -> None:
            here = parser.CurrentByteIndex
            opening = OPENING.match(self._bytes, here)
            open_elements.append((builder.start(tag, attributes), here, opening.end() if opening else here))

        def end(tag: str) -> None:
            element, begun, opened = open_elements.pop()
            self._places[element] = (begun, opened, max(opened, parser.CurrentByteIndex))
            builder.end(tag)

        parser.StartElementHandler, parser.EndElementHandler = begin, end
        parser.CharacterDataHandler = builder.data
        try:
            parser.Parse(self._bytes, True)
        except expat.ExpatError as problem:
            raise InputError(f"{self.path}: is not XML ({problem}); correct it") from None
        self.root = builder.close()
        self.parents = {child: parent for parent in self.root.iter() for child in parent}

    def set(self, element: ET.Element, name: str, value: str) -> None:
        """Give an attribute a value; it is added where the element has none of that name."""
        begin, opened, _ = self._places[element]
        tag = self._bytes[begin:opened]
        if found := re.search(ATTRIBUTE % re.escape(name).encode(), tag):
            self._changes.append((begin + found.start(1), begin + found.end(1), quoteattr(value)))
        else:
            last = begin + len(re.sub(rb"\s*/?>$", b"", tag))
            self._changes.append((last, last, f" {name}={quoteattr(value)}"))

    def unset(self, element: ET.Element, name: str) -> None:
        """Take an attribute away."""
        begin, opened, _ = self._places[element]
        if found := re.search(ATTRIBUTE % re.escape(name).encode(), self._bytes[begin:opened]):
            self._changes.append((begin + found.start(), begin + found.end(), ""))

    def set_text(self, element: ET.Element, text: str) -> None:
        """Give an element another text."""
        _, opened, end = self._places[element]
        self._write(element, (opened, end), escape(text))

    def add(self, parent: ET.Element, text: str) -> None:
        """Write an element first of all in a parent that has others, indented as these."""
        _, opened, _ = self._places[parent]
        inner = re.match(rb"\s*", self._bytes[opened:])
        self._write(parent, (opened, opened), (inner.group().decode() if inner else "") + text)

    def _write(self, element: ET.Element, place: tuple[int, int], text: str) -> None:
        """Put a text between an element's tags; one that has no last tag gets it."""
        begin, opened, _ = self._places[element]
        if empty := re.search(rb"\s*/>$", self._bytes[begin:opened]):
            place, text = (begin + empty.start(), opened), f">{text}</{element.tag}>"
        self._changes.append((*place, text))

    def text(self) -> str:
        """The file with all changes."""
        out = self._bytes
        for begin, end, new in sorted(self._changes, reverse=True):
            out = out[:begin] + new.encode() + out[end:]
        return out.decode("utf-8")

    def diff(self, output: str) -> str:
        """What changes, as `diff -u` shows it."""
        before, after = (text.splitlines(keepends=True) for text in (self._before, self.text()))
        return "".join(difflib.unified_diff(before, after, fromfile=self.path.name, tofile=output, n=1))
