/** The transcoder's script, which three ships without types: it makes the module. */
declare module "three/examples/jsm/libs/basis/basis_transcoder.js" {
  const BASIS: (options: object) => Promise<object>;
  export default BASIS;
}
