"""Finds expression statements that are several in one: `a = 1, b = 2;`. Layout does not matter; declarations, Eigen's comma initialisers,
lists in braces and the arguments of templates are none."""
import re

_TOKEN = re.compile(r"[A-Za-z_]\w*|\d[\w.']*|->|::|<<|[^\sA-Za-z_]")
_NAME = re.compile(r"[A-Za-z_]")
_TEMPLATE_ARGUMENTS = re.compile(r"\w<(?:[^<>;()=]|<[^<>;()=]*>)*>\s*[({]")
_CONTROL = {"if", "for", "while", "switch"}
_LABELS = {"case", "default", "public", "private", "protected"}
_NOT_AN_EXPRESSION = {"alignas", "return", "throw", "using", "typedef", "template", "goto", "static_assert", "namespace", "struct", "class",
                      "enum", "union", "friend", "extern"}


def _is_declaration(words):
    """Two names side by side, a type and what it declares, come before the first = ( or {; or a name stands
    behind a ), which ends a macro's call in front of the declaration."""
    if any(word == ")" and _NAME.match(following) for word, following in zip(words, words[1:])):
        return True
    depth, before = 0, []
    for word in words:
        if word in ("=", "(", "{", "<<") and depth == 0:
            return False
        if word == "<":
            depth += 1
        elif word == ">":
            depth = max(0, depth - 1)
        elif depth == 0 and _NAME.match(word) and before:
            behind_type = before[-2:-1] and (_NAME.match(before[-2]) or before[-2] == ">")
            if _NAME.match(before[-1]) or before[-1] == ">" or (before[-1] in "&*" and behind_type):
                return True
        before.append(word)
    return False


class _Bracket:
    def __init__(self, sign, of_control):
        self.sign, self.of_control, self.has_statements = sign, of_control, False
        self.begin_statement(of_control)

    def begin_statement(self, body_of_control):
        self.words, self.commas, self.start, self.body_of_control = [], [], None, body_of_control


def _opens_control(words):
    return bool(words) and (words[-1] in _CONTROL or words[-2:] == ["if", "constexpr"])


def joined_statements(code):
    """[(start, places of the commas, place of the semicolon, whether it is the body of a control statement without braces)] in `code`, which
    is without comments and strings."""
    code = re.sub(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", lambda m: re.sub(r"[^\n]", " ", m.group()), code, flags=re.MULTILINE)
    in_template = {at for m in _TEMPLATE_ARGUMENTS.finditer(code) for at in range(m.start(), m.end())}
    tokens = [(m.group(), m.start()) for m in _TOKEN.finditer(code)]
    found, stack = [], [_Bracket("{", False)]
    for (word, at), following in zip(tokens, [t for t, _ in tokens[1:]] + [""]):
        top = stack[-1]
        if word in ")]}":
            if len(stack) == 1:
                continue
            closed = stack.pop()
            top = stack[-1]
            top.words.append(word)
            ends = word == "}" and (closed.has_statements or re.match(r"[\w~]|$", following))
            if closed.of_control or ends:
                top.begin_statement(closed.of_control)
            continue
        if word == ";":
            members = ":" in top.words and "?" not in top.words  # of a constructor
            expression = top.words and top.words[0] not in _NOT_AN_EXPRESSION and not members and not _is_declaration(top.words)
            if top.sign == "{" and top.commas and expression:
                found.append((top.start, top.commas, at, top.body_of_control))
            top.has_statements = True
            top.begin_statement(False)
            continue
        if word in ("else", "do") or (word == ":" and top.sign == "{" and top.words and top.words[0] in _LABELS):
            top.begin_statement(word != ":")
            continue
        top.start = at if top.start is None else top.start
        of_control = word == "(" and _opens_control(top.words)
        if word == "," and at not in in_template and "<<" not in top.words:
            top.commas.append(at)
        top.words.append(word)
        if word in "([{":
            stack.append(_Bracket(word, of_control))
    return found
