/**
 * Types of the transcoder's script, which three.js ships without types: a function that makes the
 * module.
 */
declare module "three/examples/jsm/libs/basis/basis_transcoder.js" {
  const BASIS: (options: object) => Promise<object>;
  export default BASIS;
}
