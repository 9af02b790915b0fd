#!/usr/bin/env python3
"""Checks what no compiler checks: layers, names and the language of comments and documents.

    scripts/lint.py      # exits with 1 and names each place that breaks a rule

- An include points to its own layer or to one below it.
- Constants have names in snake_case like all others, no kConstant.
- No comment, docstring or paragraph begins with words that leave its subject open ("The same", "Of ...",
  "By which ...", "Those that ...", "That of ...").
- A sentence of a comment, a docstring or a document has at most 25 words. Numbers, formulae and names of code
  do not count, nor do tables and indented text.
- A comment's lines have at most 100 columns.
- A function has at most 60 lines, and a file of the programs and the library at most 600.
- A test file's code is in the namespace of the file's name, since groups of files are compiled together.
- A section of docs/facts.md that is cited is there. So is every file or function that a document names.
"""

import ast
import itertools
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
    "studio": ["core", "noise", "sed", "image", "parallel", "galaxy", "scene", "render", "job"],
}
OPEN_BEGINNING = re.compile(
    r"(The same\b(?! \w+ (as|for|in|of|whatever)\b)|Of [a-z]|By which\b|Those (that|which|of)\b|That of\b)"
)
# A sentence ends at one of these characters before a blank, but not behind these abbreviations.
SENTENCE_END = re.compile(
    r"(?<!\bal\.)(?<!e\.g\.)(?<!i\.e\.)(?<!\bEq\.)(?<!\bEqs\.)(?<!\bvs\.)(?<=[.!?:])[\")*`]*\s+"
)
WORD = re.compile(r"[A-Za-z]+(?:['-][A-Za-z]+)*'?")
MOST_WORDS = 25
# Lines that begin a block without being a function.
NO_FUNCTION = re.compile(
    r"\s*(namespace|class|struct|enum|union|extern|if|for|while|switch|else|do|try|catch|case|default|[}#]|//)"
)
MOST_FUNCTION_LINES = 60
MOST_FILE_LINES = 600
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


def long_sentences(text):
    """The first words of each sentence of a paragraph that has too many words."""
    text = re.sub(r"`[^`]*`|\]\([^)]*\)", " ", text)
    for sentence in SENTENCE_END.split(text):
        words = [word.strip(".,;:()\"'[]!?*") for word in sentence.split()]
        if sum(bool(WORD.fullmatch(word)) and (len(word) > 1 or word in "aAI") for word in words) > MOST_WORDS:
            yield " ".join(words[:5])


def comment_paragraphs(lines):
    """The paragraphs of comments, each with the number of its first line. Indented lines are formulae."""
    number, words = 0, []
    for here, line in enumerate([*lines, ""], 1):
        comment = re.match(r"\s*//[/!]? ?(?!<)(.*)", line)
        behind = re.match(r".*\S.*///< (.*)", line)
        is_text = comment and comment[1].strip() and comment[1][0] != " "
        if words and not (is_text and not comment[1].startswith("- ")):
            yield number, " ".join(words)
            words = []
        if is_text:
            number = number if words else here
            words.append(comment[1])
        elif behind:
            yield here, behind[1]


def script_paragraphs(lines):
    """The paragraphs of the docstrings and comments of Python, as comment_paragraphs()."""
    nodes = (ast.Module, ast.ClassDef, ast.FunctionDef)
    for node in ast.walk(ast.parse("\n".join(lines))):
        text = ast.get_docstring(node) if isinstance(node, nodes) else None
        for number, paragraph in document_paragraphs(text.splitlines()) if text else ():
            yield node.body[0].lineno + number - 1, paragraph
    for here, line in enumerate(lines, 1):
        before = re.match(r"\s*# \S", lines[here - 2]) if here > 1 else None
        if not before and re.match(r"\s*# \S", line):
            words = itertools.takewhile(bool, (re.match(r"\s*# (\S.*)", one) for one in lines[here - 1:]))
            yield here, " ".join(word[1] for word in words)


def document_paragraphs(lines):
    """The paragraphs and list items of a document, without tables, headings and code."""
    number, words, is_code = 0, [], False
    for here, line in enumerate([*lines, ""], 1):
        is_code ^= line.startswith("```")
        is_item = re.match(r"\s*([-*]|\d+\.) ", line)
        is_text = line.strip() and not is_code and not re.match(r"    |[|#!<`]", line) or (is_item and not is_code)
        if words and (is_item or not is_text):
            yield number, " ".join(words)
            words = []
        if is_text:
            number = number if words else here
            words.append(line.strip())


def check_sentences(path, paragraphs, complain):
    for number, text in paragraphs(path.read_text().splitlines()):
        for beginning in long_sentences(text):
            complain(path, number, f"more than {MOST_WORDS} words in '{beginning} ...'")
        if path.suffix == ".py" and OPEN_BEGINNING.match(text):
            complain(path, number, f"a comment begins with '{text[:20]}'")


def check_lengths(path, complain):
    """clang-format puts the brace that ends a block below the beginning of the line that opens it."""
    lines = path.read_text().splitlines()
    is_test = path.relative_to(ROOT).parts[0] == "tests"
    if len(lines) > MOST_FILE_LINES and not is_test:
        complain(path, len(lines), f"the file has more than {MOST_FILE_LINES} lines")
    begin, indent = 0, None
    for number, line in enumerate(lines, 1):
        if indent is None:
            if line.endswith("{"):
                begin = number
                while ")" in line and line.count("(") < line.count(")") and begin > 1:
                    begin -= 1  # the parameters have several lines
                    line = lines[begin - 1] + line.lstrip()
                if not NO_FUNCTION.match(line):
                    indent = len(line) - len(line.lstrip())
        elif line.strip() and len(line) - len(line.lstrip()) <= indent and line.lstrip().startswith("}"):
            if number - begin >= MOST_FUNCTION_LINES:
                complain(path, begin, f"a function has {number - begin + 1} lines")
            indent = None


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


def check_namespace(path, complain):
    text = path.read_text()
    # Files with kernels of their own are compiled alone.
    if f"namespace gamer::{path.stem} {{" not in text and "HWY_NAMESPACE" not in text:
        complain(path, 1, f"the namespace is not gamer::{path.stem}")


def check_document(path, complain):
    is_code, before = False, ""
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if line.startswith("```"):
            is_code = not is_code
        elif not is_code and not before.strip() and OPEN_BEGINNING.match(line):
            complain(path, number, f"a paragraph begins with '{line[:20]}'")
        before = line


def check_references(path, sections, complain):
    """Finds citations of missing sections and names of missing files."""
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


def check_names(path, files, words, complain):
    """Finds names of missing functions, and of missing files without a folder, in a document."""
    for number, line in enumerate(path.read_text().splitlines(), 1):
        for name in re.findall(r"`([\w:]+)\(\)`", line):
            if not words.issuperset(name.split("::")):
                complain(path, number, f"there is no {name}()")
        for name in re.findall(r"`([\w-]+\.(?:cc|cpp|h|js))`", line):
            if name not in files:
                complain(path, number, f"there is no {name}")


def main():
    found = []

    def complain(path, number, what):
        found.append(f"{path.relative_to(ROOT)}:{number}: {what}")

    folders = ("src", "include", "apps", "python", "tests", "bench", "fuzz", "examples")
    code = tracked(*[f"{folder}/**.{end}" for folder in folders for end in ("h", "cc", "cpp")])
    for path in code:
        check_code(path, complain)
        check_sentences(path, comment_paragraphs, complain)
        check_lengths(path, complain)
    for path in tracked("tests/*_test.cc"):
        check_namespace(path, complain)
    for path in tracked("studio/*.js"):
        check_sentences(path, comment_paragraphs, complain)
    documents = tracked("*.md", "docs/*.md")
    facts = (ROOT / "docs/facts.md").read_text()
    sections = set(re.findall(r"^## (\d+)\. ", facts, re.MULTILINE))
    sections |= set(re.findall(r"^\*\*(\d+\.\d+) ", facts, re.MULTILINE))
    for path in documents:
        check_document(path, complain)
        check_sentences(path, document_paragraphs, complain)
    for path in tracked("*.py"):
        check_sentences(path, script_paragraphs, complain)
    scripts = tracked("*.py", "*.sh")
    for path in code + documents + scripts:
        check_references(path, sections, complain)
    sources = code + scripts + tracked("studio/*.js")
    words = set(re.findall(r"\w+", "\n".join(path.read_text() for path in sources)))
    for path in tracked("docs/architecture.md", "docs/extending.md", "docs/method.md"):
        check_names(path, {source.name for source in sources}, words, complain)
    print("\n".join(found), end="\n" if found else "")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
