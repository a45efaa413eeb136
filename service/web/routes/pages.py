"""All pages of the dashboard, as one router."""

from fastapi import APIRouter

from service.web.routes import (
    administration,
    api_docs,
    assets,
    comparison,
    jobs,
    live,
    login,
    logs,
    materials,
    planning,
    practice,
    problems,
    sensors,
    uploads,
)

router = APIRouter()
for module in (
    api_docs,
    assets,
    login,
    materials,
    comparison,
    logs,
    live,
    sensors,
    jobs,
    uploads,
    practice,
    planning,
    administration,
    problems,
):
    router.include_router(module.router)
