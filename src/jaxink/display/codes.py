"""Codes in files that users read, each with its meaning in words."""

import enum


class CodeWithMeaning(enum.StrEnum):
    """Base of enumerations whose members are a code, as it is written to files, and a meaning."""

    meaning: str

    def __new__(cls, code: str, meaning: str):
        """A code with its meaning."""
        member = str.__new__(cls, code)
        member._value_ = code
        member.meaning = meaning
        return member
