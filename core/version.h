/* Version of Ipminmax, for the preprocessor of C and C++ programs; CMake reads it, too. Programs
 * built against one version run with the libraries of the same major and minor number. */
#ifndef IPMINMAX_VERSION_H
#define IPMINMAX_VERSION_H

#define IPMINMAX_VERSION_MAJOR 0
#define IPMINMAX_VERSION_MINOR 3
#define IPMINMAX_VERSION_PATCH 0
#define IPMINMAX_VERSION "0.3.0"

#endif
