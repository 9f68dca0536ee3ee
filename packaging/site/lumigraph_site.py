"""Headings' anchors as GitHub names them: the pages' links are written for both."""

import re


def slugify(text, separator):
    return re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", separator)
