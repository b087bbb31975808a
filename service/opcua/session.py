"""What a client may do: read, subscribe and fetch results; users also Halt and Reset. All else is refused and logged.

The library asks for a session's user before it reads for it, but takes a client's word for its certificate, and lets a
channel without security pass; here the channel's own certificate counts, and nothing passes before it.
"""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.crypto.permission_rules import SimpleRoleRuleset, User, UserRole
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_session import InternalSession

from service.opcua.trust import Trust
from service.web.people.tokens import TokenFile, TokenFileError

log = logging.getLogger("combtrace.opcua")

MOST_CONNECTIONS = 20
MOST_SUBSCRIPTIONS = 20
MOST_MONITORED = 1000  # of a subscription
LONGEST_QUEUE = 2000  # notifications kept for a client that does not ask for them
LEAST_INTERVAL_MS = 20.0

Method = Callable[[list[ua.Variant], str], Awaitable[list[ua.Variant]]]


class MethodRefused(Exception):
    """A method is not carried out: why."""


@dataclass
class Rules:
    """Who is trusted, who are users, and which methods there are for everybody and for users."""

    trust: Trust
    users: TokenFile | None
    reading: dict[ua.NodeId, Method] = field(default_factory=dict)
    ordering: dict[ua.NodeId, Method] = field(default_factory=dict)


class Permissions(SimpleRoleRuleset):
    """Which services there are: nodes are added and taken away by nobody, and before it is let in nobody has any."""

    def check_validity(self, user: User, action_type_id: ua.NodeId, body: Any) -> bool:
        """Whether it may pass; what may not is logged."""
        passes = bool(super().check_validity(user, action_type_id, body))
        if not passes:
            name = ua.ObjectIdNames.get(action_type_id.Identifier, str(action_type_id.Identifier))
            log.warning("opcua: %s refused", name.removesuffix("_Encoding_DefaultBinary"))
        return passes


class CellServer(InternalServer):
    """The library's server with sessions of ours."""

    def __init__(self, rules: Rules) -> None:
        super().__init__()
        self.rules = rules
        self.user_manager = self
        self.allow_remote_admin = False
        self.max_connections = MOST_CONNECTIONS
        self.max_subscriptions = MOST_SUBSCRIPTIONS
        self.max_monitored_item_queue_size = LONGEST_QUEUE
        self.max_unacked_messages_per_subscription = 100
        by_name = () if rules.users is None else (ua.UserNameIdentityToken,)
        self.supported_tokens = (ua.AnonymousIdentityToken, *by_name)

    def create_session(self, name: Any, user: User | None = None, external: bool = False) -> InternalSession:
        """A session of ours for a client, which until it is activated is nobody's."""
        user = user or User(UserRole.Anonymous)
        return CellSession(self, self.aspace, self.subscription_service, name, user, external)

    def get_user(
        self, _server: InternalServer, username: str | None = None, password: str | None = None, **_more: Any
    ) -> User | None:
        """Who a client is: without a name a reader; None where name and password are nobody's."""
        if username is None:
            return User(UserRole.User)
        try:
            known = self.rules.users is not None and self.rules.users.holder(password or "") == username
        except TokenFileError as error:
            log.warning("opcua: %s", error)
            return None
        return User(UserRole.User, username) if known else None

    def decrypt_user_token(self, isession: Any, token: ua.UserNameIdentityToken) -> tuple[str, str]:
        """Name and password. RSA 1.5 is refused: its answers would let a client find out what others have sent."""
        if str(token.EncryptionAlgorithm or "").endswith("rsa-1_5"):
            raise ServiceError(ua.StatusCodes.BadIdentityTokenRejected)
        name, password = super().decrypt_user_token(isession, token)
        return name, password

    def register_server(self, server: Any, conf: Any = None) -> None:
        """Refused: this is no discovery server."""
        raise ServiceError(ua.StatusCodes.BadServiceUnsupported)


class CellSession(InternalSession):
    """A client's session."""

    iserver: CellServer

    def activate_session(
        self, params: ua.ActivateSessionParameters, peer_certificate: bytes | None
    ) -> ua.ActivateSessionResult:
        """Let a client in whose channel has a trusted certificate, and whose name and password are known if any."""
        why_not = self.iserver.rules.trust.why_not(peer_certificate)
        if why_not is not None:
            log.warning("opcua: %s refused: %s", _who(self.name), why_not)
            raise ServiceError(ua.StatusCodes.BadCertificateUntrusted)
        try:
            result = super().activate_session(params, peer_certificate)
        except ServiceError as error:
            name = getattr(params.UserIdentityToken, "UserName", None)
            log.warning("opcua: %s refused: user %r, or the password, is not known", _who(self.name), name)
            raise error
        log.info("opcua: %s is let in%s", _who(self.name), f" as {self.user.name}" if self.user.name else " to read")
        return result

    async def write(self, params: ua.WriteParameters) -> list[ua.StatusCode]:
        """Refused."""
        for item in params.NodesToWrite:
            self._refused(f"write of {item.NodeId.to_string()}")
        return [ua.StatusCode(ua.StatusCodes.BadUserAccessDenied)] * len(params.NodesToWrite)

    async def call(self, params: list[ua.CallMethodRequest]) -> list[ua.CallMethodResult]:
        """What each method gives, or why it is refused."""
        return [await self._called(one) for one in params]

    async def _called(self, request: ua.CallMethodRequest) -> ua.CallMethodResult:
        rules, result = self.iserver.rules, ua.CallMethodResult()
        method = rules.reading.get(request.MethodId)
        if method is None and self.user.name is not None:
            method = rules.ordering.get(request.MethodId)
        if method is None:
            self._refused(f"call of {request.MethodId.to_string()}")
            known = request.MethodId in rules.ordering
            result.StatusCode = ua.StatusCode(
                ua.StatusCodes.BadUserAccessDenied if known else ua.StatusCodes.BadNotExecutable
            )
            return result
        try:
            who = f"{self.user.name} from {_who(self.name)}"
            result.OutputArguments = await method(list(request.InputArguments or []), who)
        except MethodRefused as refused:
            self._refused(f"call of {request.MethodId.to_string()}: {refused}")
            result.StatusCode = ua.StatusCode(ua.StatusCodes.BadInvalidState)
        except (ValueError, TypeError, AttributeError, IndexError):  # arguments of other types than the method's
            result.StatusCode = ua.StatusCode(ua.StatusCodes.BadInvalidArgument)
        result.InputArgumentResults = [ua.StatusCode()] * len(request.InputArguments or [])
        return result

    def _refused(self, what: str) -> None:
        who = f"{_who(self.name)}{f' ({self.user.name})' if self.user.name else ''}"
        log.warning("opcua: %s: %s refused", who, what)

    async def create_subscription(
        self,
        params: ua.CreateSubscriptionParameters,
        callback: Callable[..., Any],
        request_callback: Callable[..., Any] | None = None,
    ) -> ua.CreateSubscriptionResult:
        """A subscription, at no shorter interval than LEAST_INTERVAL_MS."""
        params.RequestedPublishingInterval = max(params.RequestedPublishingInterval, LEAST_INTERVAL_MS)
        return await super().create_subscription(params, callback, request_callback)

    def modify_subscription(self, params: ua.ModifySubscriptionParameters) -> ua.ModifySubscriptionResult:
        """The same for one that is there."""
        params.RequestedPublishingInterval = max(params.RequestedPublishingInterval, LEAST_INTERVAL_MS)
        return super().modify_subscription(params)

    async def create_monitored_items(
        self, params: ua.CreateMonitoredItemsParameters
    ) -> list[ua.MonitoredItemCreateResult]:
        """Items of a subscription, up to MOST_MONITORED."""
        found = self.subscription_service.subscriptions.get(params.SubscriptionId)
        there = 0 if found is None else len(found.monitored_item_srv._monitored_items)
        if there + len(params.ItemsToCreate) > MOST_MONITORED:
            raise ServiceError(ua.StatusCodes.BadTooManyMonitoredItems)
        results: list[ua.MonitoredItemCreateResult] = await super().create_monitored_items(params)
        return results


def _who(name: Any) -> str:
    """A client's address, from the transport's."""
    return f"{name[0]}:{name[1]}" if isinstance(name, tuple) else str(name)
