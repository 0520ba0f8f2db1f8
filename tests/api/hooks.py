"""What Schemathesis does not know of this interface: bodies of media types of its own."""

import schemathesis
from hypothesis import strategies

schemathesis.openapi.media_type("image/x-exr", strategies.binary(max_size=200))
