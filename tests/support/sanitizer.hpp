#pragma once

/// 1 in builds with the address or the thread sanitizer, which have allocators of their own.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define IPMINMAX_UNDER_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define IPMINMAX_UNDER_SANITIZER 1
#endif
#endif
#ifndef IPMINMAX_UNDER_SANITIZER
#define IPMINMAX_UNDER_SANITIZER 0
#endif
