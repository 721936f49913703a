/* Random bytes for programs of Rust, which import this library of Windows 10. Wine has it since 9.0, and Debian 12 has
 * Wine 8.0. Windows 10 documents the function as never failing. */
#include <windows.h>
#include <ntsecapi.h>

__declspec(dllexport) BOOL WINAPI ProcessPrng(BYTE *bytes, SIZE_T count)
{
    return RtlGenRandom(bytes, (ULONG)count);
}
