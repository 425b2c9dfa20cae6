#pragma once

/// Before the name of a namespace: what is declared there is exported by the shared library, which
/// hides everything else. Stands in the installed headers only.
#define IPMINMAX_API [[gnu::visibility("default")]]
