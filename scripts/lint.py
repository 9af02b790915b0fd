#!/usr/bin/env python3
"""Checks what no compiler checks: layers, names and the language of comments and documents.

    scripts/lint.py      # exits with 1 and names each place that breaks a rule

- An include points to its own layer or to one below it.
- Constants have names in snake_case like all others, no kConstant.
- No comment or paragraph begins with words that leave its subject open ("The same", "Of ...",
  "By which ...", "Those that ...", "That of ...").
- A comment's lines have at most 100 columns.
- A section of docs/facts.md that is cited is there, and so is every file that a document names.
"""

import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
# A layer may include those before it in its own list.
BELOW = {
    "core": [],
    "noise": ["core"],
    "sed": ["core"],
    "image": ["core"],
    "processing": ["core", "image"],
    "parallel": ["core"],
    "galaxy": ["core", "noise", "sed"],
    "scene": ["core", "noise", "sed", "image", "galaxy"],
    "render": ["core", "noise", "sed", "image", "parallel", "galaxy", "scene"],
    "job": ["core", "noise", "sed", "image", "parallel", "galaxy", "scene", "render"],
}
OPEN_BEGINNING = re.compile(
    r"(The same\b(?! \w+ (as|for|in|of|whatever)\b)|Of [a-z]|By which\b|Those (that|which|of)\b|That of\b)"
)
CONSTANT = re.compile(r"\b(constexpr|const)\b[^;=(]*\bk[A-Z]\w*\s*[=({\[]")
COLUMNS = 100


def tracked(*patterns):
    command = ["git", "-C", str(ROOT), "ls-files", *patterns]
    names = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split("\n")
    return [ROOT / name for name in names if name and (ROOT / name).exists()]


def layer_of(path):
    parts = path.relative_to(ROOT).parts
    if parts[0] == "src":
        return parts[1]
    return parts[2] if parts[:2] == ("include", "gamer") and len(parts) > 3 else None


def check_code(path, complain):
    layer = layer_of(path)
    before = ""
    for number, line in enumerate(path.read_text().splitlines(), 1):
        include = re.match(r'#include "(?:gamer/)?(\w+)/', line)
        if layer and include and include[1] in BELOW and include[1] not in (layer, *BELOW[layer]):
            complain(path, number, f"layer {layer} must not include {include[1]}")
        if CONSTANT.search(line):
            complain(path, number, "a constant's name is in snake_case")
        comment = re.match(r"\s*//[/!]?<?\s*(.*)", line)
        if comment:
            if not before and OPEN_BEGINNING.match(comment[1]):
                complain(path, number, f"a comment begins with '{comment[1][:20]}'")
            if len(line) > COLUMNS:
                complain(path, number, f"more than {COLUMNS} columns")
        before = comment[1] if comment else ""


def check_document(path, complain):
    is_code, before = False, ""
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if line.startswith("```"):
            is_code = not is_code
        elif not is_code and not before.strip() and OPEN_BEGINNING.match(line):
            complain(path, number, f"a paragraph begins with '{line[:20]}'")
        before = line


def check_references(path, sections, complain):
    """It finds citations of sections and names of files that are not there."""
    for number, line in enumerate(path.read_text().splitlines(), 1):
        for section in re.findall(r"docs/facts\.md section (\d+(?:\.\d+)?)", line):
            if section not in sections:
                complain(path, number, f"docs/facts.md has no section {section}")
        if path.suffix != ".md":
            continue
        links = re.findall(r"\]\((?!https?:|#)([^)#\s]+)", line)
        named = re.findall(r"`((?:src|include|docs|tests|scripts|scenes|galaxies|bench|apps|examples)/[\w./-]+)`", line)
        for name in links + named:
            base = path.parent if name in links else ROOT
            if not (base / name).exists() and not list(ROOT.glob(name + ".*")):
                complain(path, number, f"there is no {name}")


def main():
    found = []

    def complain(path, number, what):
        found.append(f"{path.relative_to(ROOT)}:{number}: {what}")

    folders = ("src", "include", "apps", "python", "tests", "bench", "fuzz", "examples")
    code = tracked(*[f"{folder}/**.{end}" for folder in folders for end in ("h", "cc", "cpp")])
    for path in code:
        check_code(path, complain)
    documents = tracked("*.md", "docs/*.md")
    facts = (ROOT / "docs/facts.md").read_text()
    sections = set(re.findall(r"^## (\d+)\. ", facts, re.MULTILINE))
    sections |= set(re.findall(r"^\*\*(\d+\.\d+) ", facts, re.MULTILINE))
    for path in documents:
        check_document(path, complain)
    for path in code + documents + tracked("*.py", "*.sh"):
        check_references(path, sections, complain)
    print("\n".join(found), end="\n" if found else "")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
