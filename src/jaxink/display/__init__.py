"""How objects present themselves in an interactive session: short text, tables, HTML."""
