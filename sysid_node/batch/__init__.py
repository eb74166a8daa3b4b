"""Layer ``batch``: estimators that see the whole flight at once."""

import jax

jax.config.update("jax_enable_x64", True)  # type: ignore[no-untyped-call]
