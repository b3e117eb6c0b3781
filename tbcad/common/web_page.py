"""Web pages in one file: what all of them begin and end with, with places for the rest."""

import json
import re
from collections.abc import Mapping
from html import escape

BEGIN = "<!doctype html>"
# For pages that are opened from disk: they load nothing, and send nothing.
POLICY = """\
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src {images}; \
style-src 'unsafe-inline'; script-src 'unsafe-inline'; base-uri 'none'; form-action 'none'">
"""
HEAD = """\
{{begin}}
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
{{policy}}<link rel="icon" href="data:,">
<title>{{title}}{{kind}}</title>
<style>
{{style}}
</style>
</head>
"""
FOOT = """\
<script type="application/json" id="data">{{data}}</script>
<script>
"use strict";
{{script}}
</script>
</body>
</html>
"""


def web_page(
    body: str,
    blocks: Mapping[str, str],
    *,
    title: str,
    kind: str = "",
    data: Mapping[str, object],
    begin: str = BEGIN,
    images: str = "",
) -> str:
    """A page: its HTML from <body> on, with places {{name}}, and the blocks put in by these names.

    Blocks are also the page's "style" (CSS) and "script" (JavaScript), which reads the data as
    JSON; {{title}} is a place too. The browser shows the kind behind the title. Images say where
    pictures may come from, for a page that is opened from disk; empty for one of a server, which
    sends a policy of its own.
    """
    parts = {
        "begin": begin,
        "policy": POLICY.format(images=images) if images else "",
        "title": escape(title),
        "kind": escape(kind),
        "data": json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"),
    }
    every, template = {**blocks, **parts}, HEAD + body + FOOT
    # What is put in is not looked through again.
    return re.sub(r"\{\{(\w+)\}\}", lambda found: every[found[1]], template)
