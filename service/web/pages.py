"""All pages of the dashboard, as one router."""

from fastapi import APIRouter

from service.web.routes import assets, login, materials

router = APIRouter()
for module in (assets, login, materials):
    router.include_router(module.router)
