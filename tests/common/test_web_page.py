"""Pages in one file: what is put in stays what it is, and does not end the page early."""

import json
import re

from tbcad.common.web_page import web_page

BLOCKS = {"style": "p {}", "script": "run();", "about": "{{title}}"}


def page(**more: str) -> str:
    body = "<body>\n<h1>{{title}}</h1><p>{{about}}</p>\n"
    return web_page(body, BLOCKS, title="a<b", data={"text": "</script>"}, **more)


def test_texts_are_texts() -> None:
    found = page(kind=": view")
    assert "<title>a&lt;b: view</title>" in found
    assert "<h1>a&lt;b</h1><p>{{title}}</p>" in found
    data = re.search(r'id="data">(.*?)</script>', found)
    assert data is not None
    assert json.loads(data[1]) == {"text": "</script>"}


def test_only_pages_from_disk_say_what_they_may_load() -> None:
    assert "Content-Security-Policy" not in page()
    found = page(images="data:", begin="<!doctype html>\n<!-- mine -->")
    assert found.startswith("<!doctype html>\n<!-- mine -->\n<html")
    assert "default-src 'none'; img-src data:; style-src" in found
