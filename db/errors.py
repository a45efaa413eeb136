"""The exceptions of db: one small tree. All survive pickling, since workers live in other processes."""


class DatabaseError(Exception):
    """Whatever the stores refuse or cannot do."""


class NotFound(DatabaseError, LookupError):
    """No ``kind`` of this ``name`` is stored."""

    def __init__(self, kind: str, name: str) -> None:
        self.kind, self.name = kind, name
        super().__init__(kind, name)

    def __str__(self) -> str:
        return f"no {self.kind} {self.name!r} is stored"


class AlreadyExists(DatabaseError):
    """A ``kind`` of this ``name`` is stored already."""

    def __init__(self, kind: str, name: str) -> None:
        self.kind, self.name = kind, name
        super().__init__(kind, name)

    def __str__(self) -> str:
        return f"{self.kind} {self.name!r} is stored already"


class NotEmpty(DatabaseError):
    """What is to be filled has something in it already."""

    def __init__(self, what: str, allowed: str) -> None:
        self.what, self.allowed = what, allowed
        super().__init__(what, allowed)

    def __str__(self) -> str:
        return f"{self.what} is there already; allowed: {self.allowed}"


class DriverMissing(DatabaseError):
    """The database, blob store or cluster of this URL needs a library that is not installed."""

    def __init__(self, url: str, module: str, what: str = "database", extra: str = "postgresql") -> None:
        self.url, self.module, self.what, self.extra = url, module, what, extra
        super().__init__(url, module, what, extra)

    def __str__(self) -> str:
        brings = f"stiction[{self.extra}] brings one"
        return f"{self.what} is {self.url}, whose driver {self.module} is not installed ({brings})"


class InvalidUrl(DatabaseError):
    """The URL of the database is none."""


class StorageUnavailable(DatabaseError):
    """The database or the blob folder cannot be used now: locked, full, gone. Worth another try later."""


class BlobDamaged(DatabaseError):
    """A stored file has other bytes than those that it is named for."""

    def __init__(self, sha256: str, found: str) -> None:
        self.sha256, self.found = sha256, found
        super().__init__(sha256, found)

    def __str__(self) -> str:
        return f"blob {self.sha256} has other bytes than it had: their hash is {self.found}"


class StoreMismatch(DatabaseError):
    """The database and the blob store are not those of one service: to work on them would lose files."""


class ClaimLost(DatabaseError):
    """The job is no longer this runner's to do: it was cancelled, ended, or given to another."""

    def __init__(self, job_id: str) -> None:
        self.job_id = job_id
        super().__init__(job_id)

    def __str__(self) -> str:
        return f"job {self.job_id} is not this runner's any more"


class SchemaMismatch(DatabaseError):
    """The database's tables are not those of this version of the code."""
