"""All pages of the dashboard, as one router."""

from fastapi import APIRouter

from service.web.routes import assets, login, logs, materials

router = APIRouter()
for module in (assets, login, logs, materials):
    router.include_router(module.router)
