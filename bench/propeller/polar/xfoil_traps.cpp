// Debian builds XFOIL with trapping arithmetic, and its viscous start divides by zero on purpose: it dies at the first polar. This is
// loaded in front of the Fortran library and switches nothing on. Its bytes are part of the program (xfoil_program.cpp), so that nobody
// needs a compiler.
extern "C" void _gfortran_set_fpe(int) {}
