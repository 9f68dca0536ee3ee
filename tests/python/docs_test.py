"""README, CONVENTIONS, CHANGELOG and docs/: no dead link, and every option that a shown command has exists."""

import functools
import pathlib
import re
import subprocess
import unittest

import scenes

PAGES = sorted([scenes.SOURCE / name for name in ("README.md", "CONVENTIONS.md", "CHANGELOG.md")]
               + list((scenes.SOURCE / "docs").glob("*.md")))
FENCE = re.compile(r"^\s*```")


def prose(page):
    """The page's lines without code blocks."""
    fenced = False
    for line in page.read_text(encoding="utf-8").splitlines():
        if FENCE.match(line):
            fenced = not fenced
        elif not fenced and not line.startswith("    "):
            yield line


@functools.lru_cache(None)
def anchors(page):
    """Headings as GitHub names them, and names in HTML."""
    names = {}
    found = set()
    for line in prose(page):
        found |= set(re.findall(r'<a (?:name|id)="([^"]+)"', line))
        heading = re.match(r"#+ (.*)", line)
        if not heading:
            continue
        text = re.sub(r"<!--.*?-->", "", heading.group(1))
        text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text).strip()
        slug = re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-")
        count = names.get(slug, 0)
        names[slug] = count + 1
        found.add(slug if count == 0 else f"{slug}-{count}")
    return found


class Links(unittest.TestCase):
    def test_every_link_leads_somewhere(self):
        dead = []
        for page in PAGES:
            for line in prose(page):
                for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`]*`", "", line)):
                    if re.match(r"[a-z]+:", target):
                        continue
                    file, _, anchor = target.partition("#")
                    linked = (page.parent / file).resolve() if file else page
                    if not linked.exists() or (anchor and linked.suffix == ".md" and anchor not in anchors(linked)):
                        dead.append(f"{page.name}: {target}")
        self.assertFalse(dead, "dead links:\n" + "\n".join(dead))

    def test_every_page_is_linked(self):
        linked = set()
        for page in PAGES:
            for target in re.findall(r"\]\(([^)\s#]+)", page.read_text(encoding="utf-8")):
                linked.add((page.parent / target).resolve())
        self.assertFalse([p.name for p in PAGES if p.parent.name == "docs" and p.resolve() not in linked])

    def test_the_readme_is_short(self):
        self.assertLessEqual(len((scenes.SOURCE / "README.md").read_text().splitlines()), 120)


class Pictures(unittest.TestCase):
    def test_they_are_small_and_tell_nothing_of_a_machine(self):
        pictures = list((scenes.SOURCE / "docs").rglob("*.jpg"))
        self.assertGreater(len(pictures), 5)
        for picture in pictures:
            data = picture.read_bytes()
            for word in b"oiiotool", b"Exif\0", b"/build/":
                self.assertFalse(word in data, f"{picture.name} holds {word.decode()}")
        gallery = [p.stat().st_size for p in pictures if p.parent.name == "gallery"]
        self.assertLessEqual(max(gallery), 100_000)
        self.assertLessEqual(sum(gallery), 2_000_000)


class Commands(unittest.TestCase):
    @functools.lru_cache(None)
    def help_of(self, *words):
        return subprocess.run([scenes.BIN / words[0], *words[1:]], capture_output=True, text=True).stdout

    def problem(self, line):
        """What is wrong with a shown command, or None."""
        words = line.split()
        program = words[0].split("/")[-1]
        if not (scenes.BIN / program).exists():
            return f"there is no {program}"
        text = self.help_of(program, "--help-all")
        command = next((w for w in words[1:] if re.search(rf"^  {re.escape(w)}\s{{2,}}", self.help_of(program, "--help").partition("Subcommands:")[2], re.M)), None)
        if command:
            text += self.help_of(program, command, "--help-all")
        for option in re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", line):
            if option == "--complete":
                continue
            if not re.search(rf"{option}(?![\w-])", text) and not re.search(rf"--\[?no-\]?{option[2:]}", text):
                return f"{program} {command or ''} has no option {option}"
        return None

    def test_every_shown_option_exists(self):
        wrong = []
        for page in PAGES:
            if page.name in ("CHANGELOG.md", "bad-input.md"):  # options that were, and mistyped ones
                continue
            fenced = False
            for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
                if FENCE.match(line):
                    fenced = not fenced
                shown = []
                if fenced or line.startswith("    "):
                    # A description follows after several blanks.
                    match = re.match(r"\s*(?:\$ )?((?:\S*/)?lumi-[a-z]+( \S.*)?)$", re.split(r"\s{3,}(?=\S)", line.strip() + " ")[0].strip())
                    if match and ":" not in match.group(1).split()[0]:
                        shown.append(match.group(1))
                else:
                    shown += [c for c in re.findall(r"`([^`]*)`", line) if re.match(r"lumi-[a-z]+ ", c)]
                for command in shown:
                    problem = self.problem(re.sub(r"[()|\[\]]", " ", command).replace(" KIND ", " delaunay "))
                    if problem:
                        wrong.append(f"{page.name}:{number}: {problem}: {command}")
        self.assertFalse(wrong, "\n" + "\n".join(wrong))


if __name__ == "__main__":
    unittest.main()
