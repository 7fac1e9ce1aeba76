"""A page of HTML as a reader sees it."""

from html.parser import HTMLParser


class Page(HTMLParser):
    """Tables and images of a page; fails where tags are not closed."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tables, self.images, self.words = [], [], [], ""
        self.links, self.anchors = [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        assert tag not in ("script", "link", "iframe")
        if tag not in ("meta", "br", "img"):
            self.open.append(tag)
        self.links += [value for name, value in attrs if name == "href"]
        self.anchors += [value for name, value in attrs if name == "id"]
        if tag == "img":
            self.images.append(dict(attrs))
        elif tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("td", "th"):
            self.tables[-1][-1][-1] += data
        elif "style" not in self.open:
            self.words += data

    def table(self, cell):
        """The first table with such a cell below its head."""
        return next(table for table in self.tables if any(cell in row for row in table[1:]))
