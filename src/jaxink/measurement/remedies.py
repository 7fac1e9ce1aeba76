"""What to do with a file that is no table and no measurement, by its content."""

from jaxink.measurement.table import AS_CSV

FROM_PYTHON = (
    "load it in Python and hand its table to jaxink.read(DataFrame), or save that with DataFrame.to_csv"
)
FROM_ITS_SOURCE = "ask the program that wrote it for a table as CSV text"
# So much of a file tells text from other content.
_HEAD = 4096


def remedy_for(head: bytes) -> str:
    """What to do with a file that begins so: only what a spreadsheet opens can be saved as CSV there."""
    if is_json(head):
        return FROM_PYTHON
    if is_binary(head):
        return FROM_ITS_SOURCE
    return AS_CSV


def is_json(head: bytes) -> bool:
    """Whether the text begins as JSON."""
    start = head[:_HEAD].lstrip(b"\xef\xbb\xbf \t\r\n")
    return start[:1] == b"{" or (start[:1] == b"[" and start[1:].lstrip()[:1] in (b"{", b"[", b'"'))


def is_binary(head: bytes) -> bool:
    """Whether these are no characters of a text in UTF-8, UTF-16 or Latin-1."""
    part = head[:_HEAD]
    if part.startswith((b"\xff\xfe", b"\xfe\xff")):
        return False
    controls = sum(byte < 32 and byte not in b"\t\n\r\f\x1a\x1b" for byte in part)
    return controls > 0 and controls * 100 >= len(part)
