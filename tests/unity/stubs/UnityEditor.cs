// Of UnityEditor what the package uses, likewise. Assets are remembered by their paths. What glTFast does with a
// .glb is imitated: an object of the file's node, mirrored in x, with a renderer.
using System;
using System.Collections.Generic;
using System.IO;
using System.Text;
using Newtonsoft.Json.Linq;
using UnityEngine;
using Object = UnityEngine.Object;

namespace UnityEditor
{
    public sealed class MenuItem : Attribute
    {
        public MenuItem(string itemName, bool isValidateFunction, int priority) { }
    }

    public sealed class CustomPropertyDrawer : Attribute
    {
        public CustomPropertyDrawer(Type type) { }
    }

    public abstract class PropertyDrawer
    {
        public virtual void OnGUI(Rect position, SerializedProperty property, GUIContent label) { }
    }

    /// <summary>A field of an object, by its name: FieldInfo under Unity's names.</summary>
    public class SerializedProperty
    {
        readonly object owner;
        readonly System.Reflection.FieldInfo field;
        readonly object element;
        public SerializedProperty(object element) { this.element = element; }
        SerializedProperty(object owner, System.Reflection.FieldInfo field) { this.owner = owner; this.field = field; }
        object Value { get { return field == null ? element : field.GetValue(owner); } }
        public SerializedProperty FindPropertyRelative(string relativePropertyPath)
        {
            var found = Value.GetType().GetField(relativePropertyPath);
            return found == null ? null : new SerializedProperty(Value, found);
        }
        public int arraySize { get { return ((Array)Value).Length; } set { throw new NotSupportedException(); } }
        public SerializedProperty GetArrayElementAtIndex(int index) { return new SerializedProperty(((Array)Value).GetValue(index)); }
        public string stringValue { get { return (string)Value; } set { field.SetValue(owner, value); } }
        public bool boolValue { get { return (bool)Value; } set { field.SetValue(owner, value); } }
        public int intValue { get { return (int)Value; } set { field.SetValue(owner, value); } }
    }

    public sealed class EditorGUI
    {
        public static readonly List<string> Drawn = new List<string>();  // of the stub
        public static GUIContent BeginProperty(Rect totalPosition, GUIContent label, SerializedProperty property) { return label; }
        public static void EndProperty() { }
        public static bool ToggleLeft(Rect position, string label, bool value) { Drawn.Add(position.x + "+" + position.width + " " + label); return !value; }
        public static bool PropertyField(Rect position, SerializedProperty property, GUIContent label) { Drawn.Add(position.x + "+" + position.width); return property == null; }
        public static int Popup(Rect position, int selectedIndex, string[] displayedOptions)
        {
            Drawn.Add(position.x + "+" + position.width + " " + string.Join(", ", displayedOptions) + " " + selectedIndex);
            return displayedOptions.Length - 1;
        }
    }

    public sealed class Selection
    {
        public static Object activeObject { get; set; }
    }

    public class AssetDatabase
    {
        public static readonly SortedDictionary<string, List<Object>> Assets = new SortedDictionary<string, List<Object>>();
        public static bool HasGltf = true;  // whether glTFast is in the project
        public static float MirrorX = -1;  // 1: what another importer might do

        public static void Refresh() { }
        public static void SaveAssets() { }
        public static bool DeleteAsset(string path) { return true; }
        public static void CreateAsset(Object asset, string path)
        {
            if (!Directory.Exists(Path.GetDirectoryName(path))) throw new ArgumentException("no folder for " + path);
            Assets[path] = new List<Object> { asset };
        }
        public static void AddObjectToAsset(Object objectToAdd, Object assetObject)
        {
            foreach (var each in Assets.Values)
            {
                if (each[0] == assetObject) { each.Add(objectToAdd); return; }
            }
            throw new ArgumentException("no asset " + assetObject.name);
        }
        public static T LoadAssetAtPath<T>(string assetPath) where T : Object
        {
            if (assetPath.EndsWith(".glb", StringComparison.Ordinal)) return HasGltf && File.Exists(assetPath) ? (T)(Object)Gltf(assetPath) : null;
            return Assets.ContainsKey(assetPath) ? (T)Assets[assetPath][0] : null;
        }

        static GameObject Gltf(string path)
        {
            var data = File.ReadAllBytes(path);
            var json = JObject.Parse(Encoding.UTF8.GetString(data, 20, BitConverter.ToInt32(data, 12)));
            var node = json["nodes"][0];
            var made = new GameObject((string)node["name"]);
            var at = node["translation"] == null ? new float[3] : node["translation"].ToObject<float[]>();
            var scale = node["scale"] == null ? new float[] { 1, 1, 1 } : node["scale"].ToObject<float[]>();
            made.transform.localPosition = new Vector3(MirrorX * at[0], at[1], at[2]);
            made.transform.localScale = new Vector3(scale[0], scale[1], scale[2]);
            float[] min = json["accessors"][0]["min"].ToObject<float[]>(), max = json["accessors"][0]["max"].ToObject<float[]>();
            var mesh = new Mesh { vertices = new[] { new Vector3(MirrorX * max[0], min[1], min[2]), new Vector3(MirrorX * min[0], max[1], max[2]) } };
            made.AddComponent<MeshFilter>().sharedMesh = mesh;
            made.AddComponent<MeshRenderer>();
            return made;
        }
    }

    public sealed class ShaderUtil
    {
        public static bool ShaderHasError(Shader s) { return false; }
    }

    public sealed class PrefabUtility
    {
        public static readonly List<string> Saved = new List<string>();
        public static Object InstantiatePrefab(Object assetComponentOrGameObject, Transform parent)
        {
            var made = (GameObject)assetComponentOrGameObject;  // loaded anew each time
            made.transform.SetParent(parent, false);
            return made;
        }
        public static Object InstantiatePrefab(Object assetComponentOrGameObject) { return assetComponentOrGameObject; }
        public static GameObject SaveAsPrefabAsset(GameObject instanceRoot, string assetPath)
        {
            Saved.Add(assetPath);
            return instanceRoot;
        }
    }

    public class EditorUtility
    {
        public static int ShownBars;
        public static string OpenFolderPanel(string title, string folder, string defaultName) { return ""; }
        public static bool DisplayCancelableProgressBar(string title, string info, float progress) { ShownBars = 1; return false; }
        public static void ClearProgressBar() { ShownBars = 0; }
        public static bool DisplayDialog(string title, string message, string ok) { return true; }
    }
}
