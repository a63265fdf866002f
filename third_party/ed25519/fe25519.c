/* $OpenBSD: fe25519.c,v 1.1 2014/07/22 00:41:19 deraadt Exp $ */

/*
 * Public Domain, Authors: Daniel J. Bernstein, Niels Duif, Tanja Lange,
 * Peter Schwabe, Bo-Yin Yang.
 * Copied from supercop-20130419/crypto_sign/ed25519/ref/fe25519.c
 */

/*
 * Changed for a Cortex-M4: 8 limbs of 32 bits in place of 32 limbs of 8 bits, so that a product is 64 multiplications
 * (UMLAL) and an element has 32 bytes. Elements are any value below 2^256; only fe25519_freeze makes them less than p.
 */

#include "fe25519.h"

typedef uint64_t crypto_uint64;

/* r += 38 * top, where the value is r + 2^256 * top: 2^256 = 38 modulo p */
static void fold(fe25519 *r, crypto_uint32 top)
{
  int i;
  while(top != 0)
  {
    crypto_uint64 t = (crypto_uint64)top * 38;
    for(i=0;i<8;i++)
    {
      t += r->v[i];
      r->v[i] = (crypto_uint32)t;
      t >>= 32;
    }
    top = (crypto_uint32)t;
  }
}

/* reduction modulo 2^255-19 */
void fe25519_freeze(fe25519 *r)
{
  int i,rep;
  crypto_uint64 t;
  fe25519 s;

  for(rep=0;rep<2;rep++) /* below 2^255 + 19, then below 2^255 */
  {
    t = (crypto_uint64)(r->v[7] >> 31) * 19;
    r->v[7] &= 0x7FFFFFFF;
    for(i=0;i<8;i++)
    {
      t += r->v[i];
      r->v[i] = (crypto_uint32)t;
      t >>= 32;
    }
  }
  t = 19; /* r >= p exactly when r + 19 >= 2^255, and then r - p = r + 19 - 2^255 */
  for(i=0;i<8;i++)
  {
    t += r->v[i];
    s.v[i] = (crypto_uint32)t;
    t >>= 32;
  }
  if(s.v[7] >> 31)
  {
    *r = s;
    r->v[7] &= 0x7FFFFFFF;
  }
}

void fe25519_unpack(fe25519 *r, const unsigned char x[32])
{
  int i;
  for(i=0;i<8;i++)
    r->v[i] = x[4*i] | (crypto_uint32)x[4*i+1] << 8 | (crypto_uint32)x[4*i+2] << 16 | (crypto_uint32)x[4*i+3] << 24;
  r->v[7] &= 0x7FFFFFFF;
}

void fe25519_pack(unsigned char r[32], const fe25519 *x)
{
  int i;
  fe25519 y = *x;
  fe25519_freeze(&y);
  for(i=0;i<32;i++)
    r[i] = (unsigned char)(y.v[i/4] >> 8*(i%4));
}

int fe25519_iseq_vartime(const fe25519 *x, const fe25519 *y)
{
  int i;
  fe25519 t1 = *x;
  fe25519 t2 = *y;
  fe25519_freeze(&t1);
  fe25519_freeze(&t2);
  for(i=0;i<8;i++)
    if(t1.v[i] != t2.v[i]) return 0;
  return 1;
}

unsigned char fe25519_getparity(const fe25519 *x)
{
  fe25519 t = *x;
  fe25519_freeze(&t);
  return t.v[0] & 1;
}

void fe25519_setone(fe25519 *r)
{
  fe25519_setzero(r);
  r->v[0] = 1;
}

void fe25519_setzero(fe25519 *r)
{
  int i;
  for(i=0;i<8;i++) r->v[i]=0;
}

void fe25519_neg(fe25519 *r, const fe25519 *x)
{
  fe25519 t = *x;
  fe25519_setzero(r);
  fe25519_sub(r, r, &t);
}

void fe25519_add(fe25519 *r, const fe25519 *x, const fe25519 *y)
{
  int i;
  crypto_uint64 t = 0;
  for(i=0;i<8;i++)
  {
    t += (crypto_uint64)x->v[i] + y->v[i];
    r->v[i] = (crypto_uint32)t;
    t >>= 32;
  }
  fold(r, (crypto_uint32)t);
}

void fe25519_sub(fe25519 *r, const fe25519 *x, const fe25519 *y)
{
  int i;
  int64_t t = 0; /* carries -1 and 0 */
  for(i=0;i<8;i++)
  {
    t += (int64_t)x->v[i] - y->v[i];
    r->v[i] = (crypto_uint32)t;
    t >>= 32;
  }
  while(t != 0) /* 2^256 too much were added: 38 less, at most twice */
  {
    t = -38;
    for(i=0;i<8;i++)
    {
      t += r->v[i];
      r->v[i] = (crypto_uint32)t;
      t >>= 32;
    }
  }
}

void fe25519_mul(fe25519 *r, const fe25519 *x, const fe25519 *y)
{
  int i,j;
  crypto_uint32 t[16];
  crypto_uint32 carry;

  for(i=0;i<8;i++) t[i] = 0;
  for(i=0;i<8;i++)
  {
    carry = 0;
    for(j=0;j<8;j++)
    {
      crypto_uint64 z = (crypto_uint64)x->v[i] * y->v[j] + t[i+j] + carry;
      t[i+j] = (crypto_uint32)z;
      carry = (crypto_uint32)(z >> 32);
    }
    t[i+8] = carry;
  }
  carry = 0;
  for(i=0;i<8;i++)
  {
    crypto_uint64 z = (crypto_uint64)t[i+8] * 38 + t[i] + carry;
    r->v[i] = (crypto_uint32)z;
    carry = (crypto_uint32)(z >> 32);
  }
  fold(r, carry);
}

void fe25519_square(fe25519 *r, const fe25519 *x)
{
  fe25519_mul(r, x, x);
}

/* x^(2^255-21): eight times the exponent of pow2523, and 3 */
void fe25519_invert(fe25519 *r, const fe25519 *x)
{
  int i;
  fe25519 t;
  fe25519_pow2523(&t, x);
  for(i=0;i<3;i++) fe25519_square(&t, &t);
  fe25519_mul(&t, &t, x);
  fe25519_mul(&t, &t, x);
  fe25519_mul(r, &t, x);
}

/* x^(2^252-3): of the 252 bits of the exponent all are one but bit 1 */
void fe25519_pow2523(fe25519 *r, const fe25519 *x)
{
  int i;
  fe25519 t = *x;
  for(i=250;i>=0;i--)
  {
    fe25519_square(&t, &t);
    if(i != 1) fe25519_mul(&t, &t, x);
  }
  *r = t;
}
