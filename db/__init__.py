"""The database of materials: tables, repositories, blob store."""
